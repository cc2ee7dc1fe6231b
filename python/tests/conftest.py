"""What every test needs, however the tests were started."""

import signal

# A shell that starts something in the background has it ignore Ctrl-C, which Python then leaves so.
signal.signal(signal.SIGINT, signal.default_int_handler)
