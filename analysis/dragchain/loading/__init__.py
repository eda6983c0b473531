"""What the media do to the workpiece: contact events and facet maps."""
