"""Many robots that differ by a few numbers, as tables of chains."""
