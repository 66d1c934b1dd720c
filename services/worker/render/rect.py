"""A rectangle of whole pixels."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PixelRect:
    """Pixels left <= x < right and top <= y < bottom; may be empty."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        return max(self.right - self.left, 0)

    @property
    def height(self) -> int:
        return max(self.bottom - self.top, 0)

    @property
    def is_empty(self) -> bool:
        return self.width == 0 or self.height == 0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Return the (rows, columns) that cut this rectangle out of an image array."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def grown(self, margin_px: int) -> "PixelRect":
        """Return the rectangle with `margin_px` more pixels on each side."""
        return PixelRect(
            self.left - margin_px,
            self.top - margin_px,
            self.right + margin_px,
            self.bottom + margin_px,
        )

    def clipped(self, width_px: int, height_px: int) -> "PixelRect":
        """Return the part of the rectangle inside a frame of the given size."""
        left, right = (min(max(x, 0), width_px) for x in (self.left, self.right))
        top, bottom = (min(max(y, 0), height_px) for y in (self.top, self.bottom))
        return PixelRect(left, top, right, bottom)
