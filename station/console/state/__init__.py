"""What the console works with between requests, and what changes it.

app_state      all of it together
scanner        the one owner of the scanner
open_session   the one open session, its capture loop in a thread
actions        what the operator's actions do
sessions       the folder with the sessions
settings       settings as they stand, next to those of the preset
preview        a shot that is looked at and not stored
control        which tab of a browser acts, the others watch
jobs, tasks    long work in processes of their own
shown          the state that is shown
broadcast      what is sent to browsers, and when
event_stream   events for browsers, in order, with those that a browser missed
"""
