"""Where the figures of an epoch go beside the tables, one module for each kind; base.py tells what a logger is."""
