"""Faults as data."""

from dataclasses import dataclass
from typing import Optional


@dataclass(frozen=True)
class Place:
    """Where in a text something stands: a file, a line and a column, both from 1, and the line itself."""

    file: str
    line: int
    column: int
    excerpt: str


@dataclass(frozen=True)
class Diagnostic:
    """One fault: how bad it is, where it stands, the path of the value, what is wrong, and what to do."""

    severity: str
    place: Optional[Place]
    path: str
    message: str
    hint: Optional[str]
    text: str

    def __str__(self):
        return self.text
