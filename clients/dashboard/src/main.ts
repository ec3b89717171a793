import "./style/index.css";
import { App } from "./app";
import { figures } from "./figures";

const app = new App();

/** Read-only figures of the page, for tests and for who is curious. */
Object.defineProperty(window, "cogmap", { value: Object.freeze(figures(app)) });
