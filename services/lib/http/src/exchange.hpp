#pragma once
// The part of serving a request that knows no socket.

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "core.hpp"

namespace exemplar::http {

using RequestHead = boost::beast::http::request<boost::beast::http::string_body>;

/// What a request's head decides.
struct Decision {
  std::optional<Response> refusal;  ///< answered at once, the body unread
  const RouteEntry* route = nullptr;
  Request request;  ///< without its body
  std::string subprotocol;
  bool upgrade = false;
  /// Sent with every answer.
  Headers extra;
};

/// Finds the route, asks origin rule and gate. On the network thread.
Decision Decide(Core& core, const RequestHead& head, bool wants_websocket, std::string peer,
                bool tls, std::string certificate_subject);

/// The response's head without body.
boost::beast::http::response<boost::beast::http::empty_body> HeadOf(int status,
                                                                    const Headers& headers,
                                                                    const Headers& extra,
                                                                    unsigned version);

/// Runs the handler on its thread, or at once when it is quick. `done` is called on any thread;
/// false when there is no thread for it.
bool RunHandler(Core& core, const RouteEntry& route, std::shared_ptr<Request> request,
                std::function<void(Response)> done);

}  // namespace exemplar::http
