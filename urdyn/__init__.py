"""Digital twin of Universal Robots arms: identify, track and diagnose a robot from its own data."""
