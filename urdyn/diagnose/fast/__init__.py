"""Fast kinds: a beat of rows in, events out; pushes, backlash, ringing, sensors and encoders."""
