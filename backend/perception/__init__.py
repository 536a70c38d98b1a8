"""From points of LiDARs to boxes of people and objects."""
