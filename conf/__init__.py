"""The configuration: one yaml file for each choice, shipped as berteam_cli.conf."""
