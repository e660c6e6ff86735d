"""Studies of one question each: a page with pictures, figures and the command that made it; `make studies`."""
