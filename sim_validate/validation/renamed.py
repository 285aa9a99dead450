"""Handles attributes that were renamed: reading the old name raises an error with the new one."""

from typing import NoReturn


class Renamed:
    """An attribute of a class that only raises an error naming the attribute to use instead."""

    def __init__(self, new: str) -> None:
        """Take the name that stands for the attribute now."""
        self.new = new

    def __set_name__(self, owner: type, name: str) -> None:
        """Keep the name that the attribute had."""
        self.old = name

    def __get__(self, value: object, owner: type | None = None) -> NoReturn:
        """Refuse to be read."""
        of = (owner or type(value)).__name__
        raise AttributeError(f"{of}.{self.old} is now called {self.new}: read {self.new}")
