"""What a robot that drives is judged by; the supervisor decides. Nothing here writes to a servo."""
