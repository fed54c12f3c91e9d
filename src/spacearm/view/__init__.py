"""The viewer: a problem in the browser, where it is changed by hand, planned and saved. Only `viser_app` and below need viser."""
