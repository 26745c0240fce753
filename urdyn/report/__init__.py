"""Tables, plots, one self-contained page; a folder for each kind of page, shared parts here."""
