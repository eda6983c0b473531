"""Input scripts and dumps that somebody else made: what neither LIGGGHTS nor the script tells."""
