"""The server, the files of the page, bags and exports: threads, sockets and files, no rospy."""
