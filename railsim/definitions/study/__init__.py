"""Files of several runs: studies, their analyses and designs, scenarios of campaigns."""
