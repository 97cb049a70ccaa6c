"""The exercises of the course and the engine that checks them."""

from .session import course, progress_text

__all__ = ["course", "progress_text"]
