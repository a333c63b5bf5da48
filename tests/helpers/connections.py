"""Connections of topics: a publisher keeps that of a node that was killed until it sends something."""


def reaches(publisher, node):
    """Tell whether what is published now comes to a node."""
    publisher.impl.check()
    return publisher.impl.has_connection(node)


def hears(subscriber, node):
    """Tell whether what a node publishes from now on comes to a subscriber."""
    return any(connection.callerid_pub == node for connection in list(subscriber.impl.connections))
