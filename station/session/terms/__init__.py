"""What a decision may say: description, labels, presets, rules, parts."""
