"""Tables, plots, one self-contained page; a folder for each kind of page, here what they share."""
