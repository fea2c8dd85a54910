"""The page: what folders of results hold, drawn on one HTML page that needs no network."""
