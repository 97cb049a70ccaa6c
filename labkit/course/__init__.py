"""The exercises of the course and the engine that checks them."""

from .session import course, course_map, progress_text

__all__ = ["course", "course_map", "progress_text"]
