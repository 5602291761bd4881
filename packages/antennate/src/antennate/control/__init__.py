"""From readings to joint targets: conditioning, contact, decision, gait, and the one loop."""
