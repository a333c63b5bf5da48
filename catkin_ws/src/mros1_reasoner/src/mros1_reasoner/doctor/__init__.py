"""What a first start of the meta-controller would stumble over: facts of a running system and a project, judged."""
