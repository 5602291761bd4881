"""Walk robots through loose cylinders, with and without touch.

The controllers differ in one decision: `open` walks forward whatever it feels, `timed` escapes by
the clock, `paper` follows the published table, `closed` escapes when its readings repeat; your own
is named by MODULE:CLASS or FILE.py:CLASS. All meet the same tunnels, starts and disturbances, with
their own readings or others in their place. A trial succeeds when the head crosses the exit from
inside.
"""
