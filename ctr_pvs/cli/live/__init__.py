"""ctr-pvs view: a robot that moves with sliders, in a browser.

What is shown is worked out without viser, which only the page itself needs."""
