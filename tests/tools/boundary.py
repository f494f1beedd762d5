# SPDX-License-Identifier: Apache-2.0
"""Whether any command ends badly over a file that is none.

boundary.py TAKT SOURCE [--full] [--only WORD]

Walks the help of TAKT, so that it meets every command. In each place that names a file (FILE, FOLDER, NEW-FILE,
NEW-FOLDER in the help) it puts what is none: a folder, a named pipe without a writer, an empty file, one without rights,
one of 1 TB, a device. Then it closes or fills the outputs of each command, and puts the same into the files that a graph
names. It prints how many it tried, and counts
  aborts   a signal, or an exit code above 3
  hangs    longer than the limit
  nothing  exit code 0
  unnamed  an error that does not name the file
All four must be 0; else it prints the commands, and the exit code is 1. A command of which no whole call stands in
WHOLE, although it writes files, is a mistake, too. The commit's run tries some kinds in each place, others in the next
one, and leaves out the slow commands.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

LIMIT_S = 180 if "--full" in sys.argv else 20
KINDS = {
    "FILE": ("folder", "pipe", "empty", "no rights", "1 TB", "device", "missing"),
    "FOLDER": ("file", "pipe", "no rights", "empty folder", "device", "missing"),
    "NEW-FILE": ("folder", "pipe", "no rights", "no rights to its folder", "no such folder", "full"),
    "NEW-FOLDER": ("file", "pipe", "no rights to its folder", "below a file"),
}
STREAMS = ("stdout full", "stdout closed", "stdout unread", "stderr full", "stderr closed", "stderr unread", "all closed")
# A call of each command that writes something, and how long it may be tried: the place of the file is put behind it.
# SOURCE, RECORD, REPORT, TRACE stand for what the test has made.
GRAPH = "SOURCE/graph/lasers.yaml"
WHOLE = {
    "run": f"{GRAPH} --clock virtual --for 0.3s --output OUT",
    "check": GRAPH,
    "show": GRAPH,
    "report": f"REPORT {GRAPH} --html NEW",
    "explain": "TRACE",
    "nodes": "obstacle_stop",
    "up": "SOURCE/graph/two_machines.yaml --ssh false --output OUT",
    "keys": "SOURCE/graph/two_machines.yaml --out OUT",
    "bringup": f"{GRAPH} --profile doubles --doubles --device front_laser --output OUT",
    "doctor": "",
    "replay": "RECORD --output OUT",
    "bisect": 'RECORD {"port":"obstacle_stop.stop","field":"reasons","at_least":0}',
    "log info": "RECORD",
    "log diff": "RECORD RECORD",
    "log echo": "RECORD",
    "log export": "RECORD --output NEW",
    "log cut": "RECORD --output NEW",
    "log rescue": "RING --output NEW",
    "log pull": "robot:out --ssh false --output OUT",
    "log serve": "SOURCE/graph",
    "devices": "",
    "capture": "unix:/nowhere/can NEW --for 0.1s",
    "cloud": "CLOUD",
    "eval stereo": "--sweep noise",
    "eval ego_motion": "--generated --frames 3 --sweep corners",
    "eval objects": "--study --frames 1",
    "eval objects3d": "--samples 2",
    "eval body_pose": "--people 1",
    "eval person_tracking": "--walks 1 --frames 2",
    "eval registration": "--sweep population --runs 1 --generations 10",
    "eval ground": "--frames 2",
    "eval terrain": "--drives 1",
    "eval scan_matching": "",
    "eval semantic": "--network SOURCE/graph/networks/table.yaml",
    "eval mapping": "--minutes 0 --runs 1 --clouds 3",
    "eval sift": "--frames 1",
    "eval signs": "--count 1 --passages 1",
    "eval obstacle_stop": "--trials 1",
    "eval lms200": "--rx CLOUD --index CLOUD",
    "calibrate lasers": "--seed 1",
    "calibrate stereo": "SOURCE/graph/signs",
    "calibrate rig": "SOURCE/graph/rigs/xb3_raw.yaml --out NEW",
    "profile": f"{GRAPH} --for 0.3s",
    "terrain learn": "--each 1 --out NEW",
    "train cascade": "--stages 1 --positives 5 --images 2",
    "train picture": "stop NEW --size 16",
    "objects tune": "SOURCE/graph/objects --scenes 1",
    "objects test": "SOURCE/graph/objects CLOUD",
    "objects list": "SOURCE/graph/objects",
    "echo": "x.y",
    "robot map": "",
    "image build": "--graph SOURCE/graph/lasers.yaml --machine SOURCE/packaging/machines/qemu.yaml",
    "bench": "semantic --rounds 1",
}
# Where a place wants another call than that of its command.
INSTEAD = {
    ("replay", "--report"): "RECORD --cores 1",
    ("terrain learn", "--record"): "--out NEW --pick left=0..1",
    ("eval registration", "--out"): "--source PLANES --target PLANES --reference IDENTITY --generations 10",
    ("calibrate lasers", "--out"): "SWEEPS",
    ("calibrate lasers", "--picture"): "SWEEPS",
    ("objects tune", "--roc"): "SOURCE/graph/objects --scenes 1 --object red_box",
}
SLOW = {"eval sift", "eval signs", "eval obstacle_stop", "eval stereo", "eval ego_motion", "eval objects", "eval objects3d", "eval body_pose", "eval person_tracking", "profile", "bringup",
        "eval registration", "eval ground", "eval terrain", "eval scan_matching", "eval mapping", "calibrate lasers",
        "calibrate rig", "terrain learn", "train cascade", "objects tune", "doctor", "bench"}
# Without a run that is attached to, or a right input, they come to no output: the name of the run or the input is at fault.
COMES_TO_NONE = {"echo", "robot map", "capture", "calibrate stereo", "calibrate rig", "explain", "eval lms200", "log diff"}
# Files that a graph names: the place, and a graph (of SOURCE/graph) in which it is put in place of a word.
NESTED = [
    ("rig", "people.yaml", "rigs/xb3.yaml"),
    ("world", "people.yaml", "worlds/people.xml"),
    ("schedule", "people.yaml", "../schedules/people.yaml"),
    ("database", "ace.yaml", "database: objects", "database: "),
    ("signs", "ace.yaml", "signs: signs", "signs: "),
    ("skeleton", "ace.yaml", "skeletons/human.txt"),
    ("terrain_maps", "ace.yaml", "terrain_maps: terrain.txt", "terrain_maps: "),
    ("network", "ace.yaml", "networks/table.yaml"),
]

takt, source = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
full = "--full" in sys.argv
only = sys.argv[sys.argv.index("--only") + 1] if "--only" in sys.argv else ""
work = pathlib.Path(tempfile.mkdtemp(prefix="boundary."))
environment = dict(os.environ, TAKT_HOME=str(source), XDG_RUNTIME_DIR=str(work / "runtime"), TAKT_STATE_DIR=str(work / "state"),
                   TERM="dumb")
# Root reads everything: the commands run without that right.
UNPRIVILEGED = (["setpriv", "--bounding-set=-dac_override,-dac_read_search", "--inh-caps=-dac_override,-dac_read_search"]
                if os.geteuid() == 0 else [])
mistakes = {"aborts": [], "hangs": [], "nothing": [], "unnamed": [], "not in WHOLE": []}
lock = threading.Lock()
number = 0


def tell(kind, what):
    with lock:
        mistakes[kind].append(what)


def fresh(name):
    global number
    with lock:
        number += 1
        return work / f"{number}.{name}"


def made(kind):
    """A path of that kind, and a function that takes it away."""
    path = fresh("file.yaml")
    if kind in ("device", "full"):
        return pathlib.Path("/dev/full")
    if kind == "missing":
        return path
    if kind == "no such folder":
        return path / "file.png"
    if kind == "below a file":
        path.write_text("x")
        return path / "folder"
    if kind == "folder":
        path.mkdir()
        (path / "x").write_text("x")
    elif kind == "empty folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind in ("file", "no rights"):
        path.write_text("x\n")
        os.chmod(path, 0 if kind == "no rights" else 0o644)
    elif kind == "no rights to its folder":
        path.mkdir()
        os.chmod(path, 0o555)
        return path / "file.png"
    else:
        path.touch()
        if kind == "1 TB":
            os.truncate(path, 10**12)
    return path


def run(words, streams="", unprivileged=False):
    """Exit code (None: it hung) and all that it said."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    shell = 'exec "$@"'
    for stream, descriptor in (("stdout", 1), ("stderr", 2)):
        if streams in (f"{stream} closed", "all closed"):
            shell += f" {descriptor}>&-"
        elif streams == f"{stream} full":
            shell += f" {descriptor}>/dev/full"
        elif streams == f"{stream} unread":
            shell = shell.replace('"$@"', '"$@"', 1) + f" {descriptor}> >(exec true)"
    if streams == "all closed":
        shell += " <&-"
    command = (UNPRIVILEGED if unprivileged else []) + ["bash", "-c", shell, "takt", *map(str, words)]
    process = subprocess.Popen(command, cwd=work, env=environment, stdin=subprocess.DEVNULL, start_new_session=True, **pipes)
    try:
        out, err = process.communicate(timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        process.communicate()
        return None, ""
    return process.returncode, (out + err).decode(errors="replace")


def judge(words, code, text, name=None):
    line = f"{' '.join(map(str, words[1:]))}: exit {code}: {text.strip()[-300:]}"
    if code is None:
        tell("hangs", line)
    elif code < 0 or code > 3:
        tell("aborts", line)
    elif name is not None and code == 0:
        tell("nothing", line)
    elif name is not None and str(name) not in text:
        tell("unnamed", line)


def walk(words=()):
    """Every command: its words, and its options as (name, type, required)."""
    code, text = run([takt, *words, "--help"])
    if code == 3 and "builds it" in text and not full:
        print(f"NOT TRIED: takt {words[0]} is not built")
        return
    if code != 0:
        sys.exit(f"boundary: `takt {' '.join(words)} --help` ended with {code}: {text}")
    section, commands, places = "", [], []
    for line in text.splitlines():
        if re.fullmatch(r"\w+:", line):
            section = line[:-1]
        elif section == "Subcommands" and (entry := re.match(r"  ([\w-]+)(\s|$)", line)):
            commands.append(entry[1])
        elif section in ("Positionals", "Options") and (
            entry := re.match(r"  (\S+) (FILE|FOLDER|NEW-FILE|NEW-FOLDER)\b(.*)", line)):
            places.append((entry[1].split(",")[-1] if section == "Options" else entry[1], entry[2], "REQUIRED" in entry[3]))
        elif not line.strip():
            section = section if section != "Subcommands" else section
    if not commands:
        yield " ".join(words), places
    for command in commands:
        yield from walk((*words, command))


def stand_in(text):
    for word, path in INPUTS.items():
        text = re.sub(rf"\b{word}\b", str(path), text)
    return [str(fresh("new.mcap")) if word == "NEW" else str(fresh("out")) if word == "OUT" else word for word in text.split()]


def call(command, places, place, path):
    """The command with the path in that place, and as much of the rest as it takes to come there."""
    if place.startswith("-"):
        words = stand_in(INSTEAD.get((command, place), WHOLE.get(command, "")))
        if place in words:
            at = words.index(place)
            del words[at : at + 2]
        return [takt, *command.split(), *words, place, path]
    stand_ins = {"FILE": INPUTS["CLOUD"], "FOLDER": source / "graph/objects", "NEW-FILE": fresh("new.yaml")}
    words = [path if name == place else stand_ins[wants] for name, wants, required in places
             if not name.startswith("-") and (required or name == place)]
    for name, wants, required in places:
        if name.startswith("-") and required:
            words += [name, stand_ins[wants]]
    at, word = {"objects add": (1, "name"), "train picture": (0, "stop"), "capture": (0, "unix:/nowhere/can"), "image update": (0, "robot"),
                "image write": (1, "/dev/null")}.get(command, (0, ""))
    return [takt, *command.split(), *words[:at], *([word] if word else []), *words[at:]]


INPUTS = {"SOURCE": source, "RECORD": work / "run.mcap", "REPORT": work / "run.json", "TRACE": work / "run_trace.json",
          "CLOUD": work / "cloud.ply", "PLANES": work / "planes.ply", "IDENTITY": work / "identity.txt",
          "SWEEPS": work / "sweeps.txt", "RING": work / "run/flight/ring"}


def prepare():
    (work / "runtime").mkdir()
    INPUTS["CLOUD"].write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                               "property float z\nend_header\n1 2 3\n")
    code, text = run([takt, "run", source / "graph/lasers.yaml", "--clock", "virtual", "--for", "1s", "--record", INPUTS["RECORD"],
                      "--report", INPUTS["REPORT"], "--trace", INPUTS["TRACE"], "--ring", "on", "--output", work / "run"])
    if code != 0:
        sys.exit(f"boundary: the run for the inputs ended with {code}: {text}")
    points = [f"{x / 10} {y / 10} {z / 10}" for x in range(20) for y in range(20) for z in range(20) if 0 in (x, y, z)]
    INPUTS["PLANES"].write_text(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
                                "property float z\nend_header\n" + "\n".join(points) + "\n")
    INPUTS["IDENTITY"].write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    run([takt, "calibrate", "lasers", "--generate", INPUTS["SWEEPS"]])


def try_place(command, places, place, kind, wants):
    if kind == "full":
        if command in COMES_TO_NONE or (command in SLOW and not full):
            return False
        if command not in WHOLE:
            tell("not in WHOLE", f"takt {command}: how is it called so that it writes {place}?")
            return False
    path = made(kind)
    if kind == "full" and not place.startswith("-"):
        words = [takt, *command.split(), *[path if word == "NEW" else word for word in WHOLE[command].split()]]
        words = [str(word) for part in words for word in ([part] if part == path or part == takt else stand_in(str(part)))]
    else:
        words = call(command, places, place, path)
    if kind == "full" and "picture" in place:
        return False  # the ending tells the format, and /dev/full has none
    code, text = run(words, unprivileged="rights" in kind)
    judge(words, code, text, path)
    return True


def try_stream(command, stream):
    if command in SLOW and not full:
        words = [takt, *command.split(), "--help"]
    else:
        words = [takt, *command.split(), *stand_in(WHOLE.get(command, ""))]
    code, text = run(words, stream)
    judge(words, code, text)
    if words[-1] == "--help" and stream == "stdout full" and code == 0:
        tell("nothing", f"takt {command} --help into a full disk")
    return True


def try_nested(name, graph, word, key, kind):
    path = made(kind)
    text = (source / "graph" / graph).read_text()
    if word not in text:
        sys.exit(f"boundary: {graph} has no `{word}` any more; correct NESTED")
    text = text.replace(word, f"{key}{path}")
    base = f"{source}/graph"
    text = re.sub(r"(?<=[ {])((?:\.\./schedules|rigs|worlds|skeletons|networks)/[\w./]+)", rf"{base}/\1", text)
    text = re.sub(r"(?<=database: )objects\b|(?<=signs: )signs\b|(?<=terrain_maps: )terrain.txt|(?<=: )objects_3d.txt", lambda m: f"{base}/{m[0]}", text)
    file = fresh("graph.yaml")
    file.write_text(text)
    words = [takt, "check", file]
    code, said = run(words, unprivileged="rights" in kind)
    judge([takt, f"check ({name}: {kind})"], code, said, path)
    return True


prepare()
commands = [(command, places) for command, places in walk() if only in command]
tasks = []


def chosen(kinds, share):
    """All of them in the full run; else some, which are others in the next place."""
    if full or only:
        return kinds
    begin = len(tasks) % len(kinds)
    return (kinds[begin:] + kinds[:begin])[:share]


for command, places in commands:
    for place, wants, _ in places:
        tasks += [(try_place, command, places, place, kind, wants) for kind in chosen(KINDS[wants], 1 if command in SLOW else 2)]
    if command not in ("top", "double", "new"):  # they end when they are told to; `new` makes a folder
        # `web` and `ros2` serve until they are told to end, unless their address cannot be written. A closed stream is as /dev/null, and a reader
        # may leave later.
        streams = ("stdout full",) if command in ("web", "ros2") else STREAMS
        tasks += [(try_stream, command, stream) for stream in chosen(streams, 1)]
if not only:
    tasks += [(try_nested, name, graph, word, rest[0] if rest else "", kind)
              for name, graph, word, *rest in NESTED for kind in chosen(KINDS["FOLDER" if name in ("database", "signs") else "FILE"], 2)]
taken = []


def timed(task):
    begin = time.monotonic()
    done = task[0](*task[1:])
    taken.append((time.monotonic() - begin, " ".join(str(word) for word in task[1:] if isinstance(word, str))))
    return done


with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    tried = sum(pool.map(timed, tasks))
subprocess.run(["chmod", "-R", "u+rwX", work], check=False)
subprocess.run(["rm", "-rf", work], check=False)
print("the slowest, s:", *(f"{seconds:.1f} {what}" for seconds, what in sorted(taken, reverse=True)[:8]), sep="\n  ")
print(f"{len(commands)} commands, {sum(len(places) for _, places in commands)} places of files, "
      f"{len(set().union(*KINDS.values()) | set(STREAMS))} kinds: {tried} tried, "
      + ", ".join(f"{len(found)} {kind}" for kind, found in mistakes.items()))
for kind, found in mistakes.items():
    for what in found:
        print(f"{kind}: {what}")
sys.exit(1 if any(mistakes.values()) else 0)
