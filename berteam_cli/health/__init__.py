"""What `berteam doctor` examines."""
