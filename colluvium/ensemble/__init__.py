"""Many runs of one scene: values of its keys and seeds, on this machine or on a cluster, with intervals (`colluvium sweep`)."""
