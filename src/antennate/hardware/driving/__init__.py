"""A robot that walks: one session between bytes and a controller, from dry run to torque off."""
