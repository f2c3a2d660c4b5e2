"""A run as one page to read: source.py reads it, the plots draw it, page.py puts it together.

drawing.py tells how a plot looks, in light and dark; chosen.py, strength.py, members.py, watched.py and course.py draw
one kind of plot each; film.py brings the replay; overview.py the tables of several runs.
"""
