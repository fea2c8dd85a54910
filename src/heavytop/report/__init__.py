"""Tables, the files of a result, and the page of a report."""
