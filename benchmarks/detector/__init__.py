"""How well a hand-landmark model trained on photographs reads hi5's pictures."""
