"""The report of a campaign: from the rows of its table to statistics, verdicts, pages and figures. Pure."""
