#pragma once
// What the examples share: how an error is shown, and who calls.

#include <cstdlib>
#include <exemplar/client.hpp>
#include <iostream>
#include <string>

/// "not_found: there is no skill "press" (skill.name)" on stderr; returns the exit code.
inline int Fail(const exemplar::Error& error) {
  std::cerr << exemplar::ToString(error.code) << ": " << error.message;
  if (!error.field.empty()) std::cerr << " (" << error.field << ")";
  std::cerr << '\n';
  return 1;
}

inline std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

/// A server, and what is shown to it: the same variables as the command line's. Without a CA, plain
/// text; a token then leaves this machine never.
inline exemplar::rpc::ClientOptions OptionsFor(const std::string& server) {
  exemplar::rpc::ClientOptions options;
  options.server = server;
  options.credentials = {.ca = Environment("EXEMPLAR_TLS_CA"),
                         .certificate = Environment("EXEMPLAR_TLS_CERT"),
                         .key = Environment("EXEMPLAR_TLS_KEY"),
                         .token = Environment("EXEMPLAR_TOKEN")};
  return options;
}

/// The words NAME X Y Z from `words` on.
inline exemplar::geometry::NamedPose ObjectOf(char** words) {
  exemplar::geometry::NamedPose object;
  object.name = words[0];
  object.has_orientation = false;
  for (int i = 0; i < 3; ++i) {
    object.base_T_object.translation[i] = std::strtod(words[1 + i], nullptr);
  }
  return object;
}
