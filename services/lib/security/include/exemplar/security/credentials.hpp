#pragma once
// What a program is told of its keys and of who may call it: the options that servers and clients
// share.

#include <string>

namespace exemplar::security {

/// How a server proves who it is, and whom it lets in. All empty: plain text, everybody may call.
struct ServerCredentials {
  /// PEM files: the server's certificate (with those between it and the CA behind it) and its key.
  /// Both or neither; read again when they change.
  std::string certificate = {};
  std::string key = {};
  /// PEM file of the CA that callers' certificates come from; with it, every caller must have one.
  std::string client_ca = {};
  /// The access file (access.hpp): who has which roles; read again when it changes.
  std::string access = {};
  /// Listen beyond loopback without TLS, or with TLS for everybody.
  bool insecure_listen = false;
  /// What each caller may do in a second, in the mean; bursts of twice that pass. Zero: no limit.
  /// Callers of this machine that nobody has to know (no access file) are not limited.
  double calls_per_s = 200;
};

/// How a client proves who it is, and whom it believes.
struct ClientCredentials {
  /// PEM file of the CA that the server's certificate comes from; empty: plain text.
  std::string ca = {};
  /// PEM files: the client's certificate and its key, both or neither.
  std::string certificate = {};
  std::string key = {};
  /// Sent with each call; "@FILE" takes it from a file. Never in plain text beyond loopback.
  std::string token = {};
};

}  // namespace exemplar::security
