"""The study of the paper against the paper: what of Uhlmann et al. (2015) our runs bear out."""
