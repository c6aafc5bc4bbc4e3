"""Verbs about robot files: listing, showing and writing them."""
