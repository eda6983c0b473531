"""Input scripts as LIGGGHTS reads them: commands, what they do in order, and rules on them."""
