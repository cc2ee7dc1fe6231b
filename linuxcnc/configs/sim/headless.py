#!/usr/bin/python3
"""Runs the part program of an INI file without a screen: [DISPLAY]DISPLAY of the check."""
import os, sys, time
import linuxcnc

ini_file = sys.argv[sys.argv.index("-ini") + 1]
ini = linuxcnc.ini(ini_file)
status, command, errors = linuxcnc.stat(), linuxcnc.command(), linuxcnc.error_channel()


def end(words):
    """Leaves how it ended beside the INI file: what is printed goes elsewhere."""
    with open(os.path.join(os.path.dirname(ini_file), "result"), "w") as result:
        print(words, file=result)
    sys.exit()


def poll():
    status.poll()
    error = errors.poll()
    if error:
        end(error[1])


def wait(done, seconds, what):
    end = time.monotonic() + seconds
    poll()
    while not done():
        if time.monotonic() > end:
            end("waited in vain: " + what)
        time.sleep(0.02)
        poll()


command.state(linuxcnc.STATE_ESTOP_RESET)
wait(lambda: status.task_state != linuxcnc.STATE_ESTOP, 5, "emergency stop reset")
command.state(linuxcnc.STATE_ON)
wait(lambda: status.task_state == linuxcnc.STATE_ON, 5, "machine on")
time.sleep(0.3)
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
wait(lambda: all(status.homed[:3]), 10, "homed")
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.program_open(ini.find("DISPLAY", "OPEN_FILE"))
command.wait_complete()
command.auto(linuxcnc.AUTO_RUN, 0)
time.sleep(0.5)
wait(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos, 120, "program")
wait(lambda: status.task_state == linuxcnc.STATE_ON, 0.1, "machine still on")
end("done")
