#include "http_connection.hpp"

namespace exemplar::http {

void ServePlain(Core& core, boost::asio::ip::tcp::socket socket,
                std::unique_ptr<Admitted> admitted) {
  using PlainStream = boost::beast::tcp_stream;
  std::make_shared<HttpConnection<PlainStream>>(core, PlainStream(std::move(socket)),
                                                std::move(admitted), false, std::string())
      ->Start();
}

}  // namespace exemplar::http
