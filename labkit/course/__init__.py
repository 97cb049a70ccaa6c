"""The exercises of the course and the engine that checks them."""
