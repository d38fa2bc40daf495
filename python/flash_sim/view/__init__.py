"""A viewer in the browser of what flash simulates and of what was seen: `python -m flash_sim.view run|scene|recording`.

The page is served on 127.0.0.1 alone. It needs viser: pip install 'flash-sim[view]'.
"""
