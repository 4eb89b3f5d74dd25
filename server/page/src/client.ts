// The JavaScript client as one module for pages without a bundler: /page/enfilade.js.
export {
  Client, connect, ConnectionFailed, loadSchemas, pixels, PROTOCOL_VERSION, schemasOf, ServerError,
} from "enfilade-client";
