"""What berteam adds to Hydra: the sweeper that runs what is listed in a sweep's folder, and a launcher for Ray."""
