"""Reports of recordings: levels, indicators, comparisons, trends, speed maps."""
