"""Whether plans and refusals of random specs are what hi5 promises, judged by code of its own."""
