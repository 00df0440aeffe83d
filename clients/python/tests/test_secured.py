"""TLS, certificates of both sides, tokens and roles, against programs that want them."""

import asyncio
import pathlib
from collections.abc import Awaitable, Callable

import pytest

import exemplar
from conftest import SecuredStation, Shown, security


def awaited(client: exemplar.AsyncClient, call: Callable[[exemplar.AsyncClient], Awaitable[object]]) -> object:
    """One call of a client of asyncio, from a loop of its own."""

    async def body() -> object:
        async with client:
            return await call(client)

    return asyncio.run(body())


def test_a_token_has_its_roles_and_no_more(secured: SecuredStation, files: list[pathlib.Path]) -> None:
    with exemplar.Client(secured.gateway, tls_ca=secured.ca, token=secured.token) as client:
        assert client.skills.list() == ()
        with pytest.raises(
            exemplar.PermissionDeniedError, match="takes the role teach, and ben has observe"
        ) as refused:
            client.trials.submit("press", files[0])
        assert (refused.value.code, refused.value.field) == ("permission_denied", "role")
        assert isinstance(refused.value, PermissionError)
        with pytest.raises(exemplar.PermissionDeniedError, match="ben"):
            client.skills.learn("press").result()
        with pytest.raises(exemplar.PermissionDeniedError, match="ben"):
            client.topics.publish("ircp/objects", {})


def test_asyncio_is_refused_alike(secured: SecuredStation) -> None:
    def client(token: str) -> exemplar.AsyncClient:
        return exemplar.AsyncClient(secured.gateway, tls_ca=secured.ca, token=token)

    async def learn(of: exemplar.AsyncClient) -> object:
        return await of.skills.learn("press").result()

    assert awaited(client(secured.token), lambda c: c.skills.list()) == ()
    with pytest.raises(exemplar.PermissionDeniedError, match="role teach"):
        awaited(client(secured.token), learn)
    with pytest.raises(exemplar.UnauthenticatedError, match="not known"):
        awaited(client("exm_guess"), learn)


def test_who_shows_no_token_or_one_that_is_not_known_is_told_so(secured: SecuredStation) -> None:
    for token, said in ((None, "wants a token"), ("exm_guess", "not known")):
        with exemplar.Client(secured.gateway, tls_ca=secured.ca, token=token) as client:
            with pytest.raises(exemplar.UnauthenticatedError, match=said) as refused:
                client.skills.list()
            assert (refused.value.code, refused.value.field) == ("unauthenticated", "token")
            with pytest.raises(exemplar.UnauthenticatedError, match=said):
                next(client.topics.subscribe("ircp/*"))


def test_a_token_that_was_taken_back_counts_no_more(secured: SecuredStation, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "token"
    file.write_text(security("token", secured.files, "carl", "--role", "observe"))
    with exemplar.Client(secured.gateway, tls_ca=secured.ca, token=f"@{file}") as client:
        assert client.trials.list() == ()
        security("revoke", secured.files, "carl")
        with pytest.raises(exemplar.UnauthenticatedError):
            client.trials.list()


def test_certificates_of_both_sides_let_a_teacher_teach(secured: SecuredStation, files: list[pathlib.Path]) -> None:
    with exemplar.Client(secured.learning, **secured.certificate("anna")) as client:
        skill = client.skill("secured")
        skill.submit(*files[:3])
        assert skill.learn().result().version == 1
        with skill.query_stream() as stream:
            assert len(stream.query({"target": [0.55, -0.15, 0.05]})) > 10
    with exemplar.Client(secured.learning, **secured.certificate("otto")) as observer:
        assert len(observer.skill("secured").query([0.55, -0.15, 0.05])) > 10
        with pytest.raises(exemplar.PermissionDeniedError, match=r"otto may not call .*Delete"):
            observer.skills.delete("secured")
    with pytest.raises(exemplar.PermissionDeniedError, match="role administer"):
        awaited(
            exemplar.AsyncClient(secured.learning, **secured.certificate("anna")),
            lambda c: c.skills.delete("secured"),
        )


def test_who_is_not_believed_gets_no_answer(secured: SecuredStation, tmp_path: pathlib.Path) -> None:
    security("init", tmp_path / "other", "--station", "other")
    security("issue", tmp_path / "other", "anna", "--role", "person", "--call", "teach")
    stranger = tmp_path / "other" / "members" / "anna"
    no_certificate = Shown(tls_ca=secured.ca)
    plain_text = Shown()
    other_certificate = Shown(tls_ca=secured.ca, tls_cert=str(stranger / "cert.pem"), tls_key=str(stranger / "key.pem"))
    other_server = secured.certificate("anna")
    other_server["tls_ca"] = str(stranger / "ca.pem")
    for shown in (no_certificate, plain_text, other_certificate, other_server):
        with exemplar.Client(secured.learning, **shown) as client, pytest.raises(exemplar.UnavailableError):
            client.skills.list(timeout=5)
        with pytest.raises(exemplar.UnavailableError):
            awaited(exemplar.AsyncClient(secured.learning, **shown), lambda c: c.skills.list(timeout=5))
