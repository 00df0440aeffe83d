"""Whom a client believes and how it proves who it is, before anything is sent."""

import pathlib

import pytest

import exemplar


def test_a_token_never_crosses_a_network_in_plain_text() -> None:
    with pytest.raises(exemplar.FailedPreconditionError) as refused:
        exemplar.Client("robot.example:50051", token="secret")
    assert refused.value.field == "tls_ca"
    assert "robot.example" in refused.value.message
    for address in ("127.0.0.1:50051", "localhost:50051", "[::1]:50051"):
        exemplar.Client(address, token="secret").close()


def test_keys_that_do_not_make_sense_name_the_field(tmp_path: pathlib.Path) -> None:
    with pytest.raises(exemplar.InvalidArgumentError) as alone:
        exemplar.Client(tls_cert="a.pem")
    assert alone.value.field == "tls_cert"
    with pytest.raises(exemplar.InvalidArgumentError) as nobody:
        exemplar.Client(tls_cert="a.pem", tls_key="b.pem")
    assert nobody.value.field == "tls_ca"
    missing = tmp_path / "none.pem"
    with pytest.raises(exemplar.InvalidArgumentError) as unread:
        exemplar.AsyncClient(tls_ca=str(missing))
    assert str(missing) in unread.value.message
    assert unread.value.field == "tls_ca"


def test_a_token_comes_from_a_file_or_the_environment(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "token"
    file.write_text("secret\n")
    for client in (exemplar.Client(token=f"@{file}"), exemplar.Client(token="secret")):
        assert ("authorization", "Bearer secret") in client._link.settings.metadata()
    monkeypatch.setenv("EXEMPLAR_TOKEN", "other")
    assert ("authorization", "Bearer other") in exemplar.Client()._link.settings.metadata()
    monkeypatch.delenv("EXEMPLAR_TOKEN")
    assert len(exemplar.Client()._link.settings.metadata()) == 1
