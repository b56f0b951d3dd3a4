"""The capture loop: shoot, restore in the background, verdict, accept or shoot again.

keys  the keyboard and the foot-switch, as names of actions
loop  what happens on each key and at the end of each restoration
"""
