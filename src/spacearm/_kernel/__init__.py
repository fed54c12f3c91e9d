"""The compiled kernel, one module an instruction level; `spacearm.core.native` chooses one."""


def __getattr__(name: str) -> object:
    from spacearm.core.moved import moved_name

    return moved_name(__name__, name)
