"""The viewer: a problem in the browser, changed by hand, planned and saved. Only `viser_app` and what it imports need viser."""
