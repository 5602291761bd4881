"""One file per experiment: what varies, what is measured, what it returns."""
