"""How photographs were taken: the loads, and the texts in their EXIF."""
