"""Independent answers to compare the package with: numpy and scipy only, nothing of notchflex.

Every module here is itself checked against the reference numbers, in
``tests/validation/test_oracles.py``; a test that disagrees with one of them points at the package.
"""
