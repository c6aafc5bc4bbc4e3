"""What the page says about numbers that it does not take as they were typed."""

from __future__ import annotations


def beyond(label: str, value: float, ends: tuple[float, float], further: bool) -> str:
    """Return that a value lies beyond its slider, and what was set instead.

    Args:
        label: Text of the slider, with its unit in brackets.
        value: What was typed.
        ends: Least and largest value of the slider.
        further: Whether the slider can be made to go further.

    Example:
        >>> beyond("tension [N]", 30.0, (0.0, 3.0), further=False)
        'tension: 30 N is beyond its slider, which goes from 0 to 3 N. It is set to 3 N.'
    """
    name, _, unit = label.removesuffix("]").partition(" [")
    low, high = ends
    remedy = "; 'slider to' lets it go further" if further and value > high else ""
    return (
        f"{name}: {value:g} {unit} is beyond its slider, which goes from {low:g} to {high:g} "
        f"{unit}. It is set to {min(max(value, low), high):g} {unit}{remedy}."
    )


def kept_between(low: float, high: float) -> str:
    """Return between which numbers the end of a slider must lie."""
    return f"The slider can end from {low:g} to {high:g} only."


__all__ = ["beyond", "kept_between"]
