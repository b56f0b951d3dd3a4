"""The commands of `planish`, one file for each group, and the options that they take."""
