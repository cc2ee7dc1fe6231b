#!/usr/bin/python3
"""Runs the part program of an INI file without a screen: [DISPLAY]DISPLAY of the check."""
import os, subprocess, sys, time
import linuxcnc

ini_file = sys.argv[sys.argv.index("-ini") + 1]
ini = linuxcnc.ini(ini_file)
status, command, errors = linuxcnc.stat(), linuxcnc.command(), linuxcnc.error_channel()


def leave(name, lines):
    """Leaves a file beside the INI file: what is printed goes elsewhere."""
    with open(os.path.join(os.path.dirname(ini_file), name), "w") as file:
        file.writelines(lines)


def end(words):
    leave("result", [words + "\n"])
    sys.exit()


def getp(name):
    return subprocess.check_output(["halcmd", "getp", name], text=True)


def poll():
    status.poll()
    error = errors.poll()
    if error:
        faults = subprocess.run(["halcmd", "show", "pin", "quadrant.*.fault"], capture_output=True, text=True)
        end(error[1] + "\n" + faults.stdout)


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
# The largest step of each voltage at the index.
leave("index", [getp("quadrant_plant.%s.index-step" % axis) for axis in "xyz"])
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.program_open(ini.find("DISPLAY", "OPEN_FILE"))
command.wait_complete()
ends = time.monotonic() + 60 * float(ini.find("DISPLAY", "MINUTES"))
functions = ["quadrant.update", "pid.0.do-pid-calcs", "motion-controller", "servo-thread"]
times = []


def done():
    if ends > started:
        times.append([getp(function + ".time").strip() for function in functions])
    return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos


while True:
    started = time.monotonic()
    command.auto(linuxcnc.AUTO_RUN, 0)
    time.sleep(0.5)
    wait(done, 120, "program")
    if time.monotonic() > ends:
        break
if times:
    longest = [getp(function + ".tmax").strip() for function in functions]
    leave("times", [" ".join(line) + "\n" for line in times + [longest]] + [getp("timedelta.0.jitter")])
wait(lambda: status.task_state == linuxcnc.STATE_ON, 0.1, "machine still on")
end("done")
