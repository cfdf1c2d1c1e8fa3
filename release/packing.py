"""Archives that are the same, byte for byte, whenever and by whomever they are made of the same files."""

import gzip
import hashlib
import io
import os
import subprocess
import tarfile
import tempfile
import zipfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

MAINTAINER = "The calibench developers <calibench@users.noreply.github.com>"


@dataclass(frozen=True)
class File:
    """What stands in an archive at one path."""

    content: bytes
    runs: bool = False

    @property
    def mode(self) -> int:
        return 0o755 if self.runs else 0o644


Files = dict[str, File]


def gzipped(content: bytes) -> bytes:
    """Without a name and a time."""
    return gzip.compress(content, compresslevel=9, mtime=0)


def folders(files: Files) -> list[str]:
    """Every folder above the files, parents first."""
    return sorted({str(parent) for path in files for parent in Path(path).parents if str(parent) != "."})


def tar_gz(files: Files, epoch: int) -> bytes:
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for path in sorted(folders(files) + list(files)):
            entry = tarfile.TarInfo(path)
            entry.mtime = epoch
            entry.uname = entry.gname = "root"
            file = files.get(path)
            if file is None:
                entry.type, entry.mode = tarfile.DIRTYPE, 0o755
                tar.addfile(entry)
            else:
                entry.size, entry.mode = len(file.content), file.mode
                tar.addfile(entry, io.BytesIO(file.content))
    return gzipped(packed.getvalue())


def zipped(files: Files, epoch: int) -> bytes:
    packed = io.BytesIO()
    when = datetime.fromtimestamp(epoch, UTC).timetuple()[:6]
    with zipfile.ZipFile(packed, "w") as archive:
        for path, file in sorted(files.items()):
            entry = zipfile.ZipInfo(path, when)
            entry.create_system = 3  # The modes below are those of Unix, wherever this runs.
            entry.external_attr = (0o100000 | file.mode) << 16
            archive.writestr(entry, file.content, zipfile.ZIP_DEFLATED, 9)
    return packed.getvalue()


def deb(files: Files, control: dict[str, str], epoch: int) -> bytes:
    """A package of Debian; `files` by their paths in the system, without the leading slash."""
    sums = "".join(f"{hashlib.md5(file.content).hexdigest()}  {path}\n" for path, file in sorted(files.items()))
    control = control | {"Installed-Size": str(sum((len(file.content) + 1023) // 1024 for file in files.values()) + len(folders(files)))}
    # A description is the last field, and may have more lines.
    control["Description"] = control.pop("Description")
    fields = "".join(f"{key}: {value}\n" for key, value in control.items())
    staged = files | {"DEBIAN/control": File(fields.encode()), "DEBIAN/md5sums": File(sums.encode())}
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch, "root")
        for path, file in staged.items():
            root.joinpath(path).parent.mkdir(parents=True, exist_ok=True)
            root.joinpath(path).write_bytes(file.content)
            root.joinpath(path).chmod(file.mode)
        for folder in reversed([".", *folders(staged)]):
            root.joinpath(folder).chmod(0o755)
        for path in [*staged, *reversed(folders(staged)), "."]:
            os.utime(root / path, (epoch, epoch))
        made = Path(scratch, "made.deb")
        # With one thread: the blocks of several are packed otherwise.
        environment = os.environ | {"SOURCE_DATE_EPOCH": str(epoch), "DPKG_DEB_THREADS_MAX": "1"}
        command = ["dpkg-deb", "--root-owner-group", "-Zxz", "--build", str(root), str(made)]
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        return made.read_bytes()
