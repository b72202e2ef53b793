"""Sessions: the state that documents and control messages change, without sockets and clock."""
