"""The wire: one table of topics, ROS 2 messages in CDR, Zenoh sessions."""
