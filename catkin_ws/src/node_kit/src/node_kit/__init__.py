"""Parts that all nodes share: parameters, work for one thread, calls with a deadline, plug-ins, start and end."""
