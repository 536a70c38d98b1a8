"""From detections to tracks of people and objects, and where they will be."""
