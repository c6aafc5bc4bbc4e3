"""Circumstances of photographs: the loads, and the texts in their EXIF."""
