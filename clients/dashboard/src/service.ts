/** The HTTP interface of the service, as far as the page asks it. */

import { parse, stringify, type Int64 } from "./json";
import { Problem } from "./problem";
import { readCloud, type CloudFile } from "./ply";
import { token } from "./token";
import type {
  AgentDetail,
  AgentObject,
  Blockage,
  Channel,
  EventRecord,
  FollowedRoute,
  FollowedSummary,
  GridState,
  Landmark,
  Leg,
  ObjectDetail,
  ObjectSummary,
  Place,
  Prediction,
  Quat,
  RecalledPlace,
  RememberedPercept,
  Route,
  Sequence,
  SpaceInfo,
  Trajectory,
  Trip,
  Vec3,
} from "./wire";

/** Most pages of one list that the page asks for. */
const PAGES_MAX = 64;
/** Items of a page: as many as there may be. */
const PAGE_ITEMS = 1000;

async function ask(path: string, init: RequestInit = {}): Promise<Response> {
  const headers = new Headers(init.headers);
  const secret = token.get();
  if (secret !== null) {
    headers.set("authorization", `Bearer ${secret}`);
  }
  const answer = await fetch(path, { ...init, headers });
  if (!answer.ok) {
    throw await Problem.of(answer);
  }
  return answer;
}

async function get<T>(path: string, signal?: AbortSignal): Promise<T> {
  const answer = await ask(path, signal === undefined ? {} : { signal });
  return parse(await answer.text()) as T;
}

async function post<T>(path: string, body: unknown): Promise<T> {
  const headers = { "content-type": "application/json" };
  const answer = await ask(path, { method: "POST", headers, body: stringify(body) });
  return parse(await answer.text()) as T;
}

function query(parameters: Record<string, string | number | bigint | undefined>): string {
  const present = Object.entries(parameters).filter(([, value]) => value !== undefined);
  return new URLSearchParams(present.map(([key, value]) => [key, String(value)])).toString();
}

export async function spaces(signal?: AbortSignal): Promise<SpaceInfo[]> {
  return (await get<{ spaces: SpaceInfo[] }>("/v1/spaces", signal)).spaces;
}

/** The questions about one space. */
export class Space {
  private readonly base: string;

  constructor(readonly name: string) {
    this.base = `/v1/spaces/${encodeURIComponent(name)}`;
  }

  /** Opens the live stream. */
  live(rateHz: number, signal: AbortSignal): Promise<Response> {
    return ask(`${this.base}/live?${query({ rate_hz: rateHz })}`, { signal });
  }

  /** The places, all or those that changed since a revision. */
  async cloud(sinceRevision?: Int64): Promise<CloudFile> {
    const asked = { format: "ply", encoding: "binary", since_revision: sinceRevision };
    const answer = await ask(`${this.base}/export?${query(asked)}`);
    return readCloud(await answer.arrayBuffer());
  }

  async landmarks(): Promise<Landmark[]> {
    return this.all<Landmark>("landmarks", "landmarks");
  }

  /** Trips under way at or after a stamp. */
  async trips(sinceNs?: Int64): Promise<Trip[]> {
    return this.all<Trip>("trips", "trips", { since_ns: sinceNs });
  }

  async legs(trip: number): Promise<Leg[]> {
    return (await get<{ legs: Leg[] }>(`${this.base}/trips/${trip}`)).legs;
  }

  /** The events that the service keeps, oldest first. */
  async events(): Promise<EventRecord[]> {
    return this.all<EventRecord>("events", "events", { format: "json", after: "0-0" });
  }

  async objects(): Promise<ObjectSummary[]> {
    return this.all<ObjectSummary>("objects", "objects");
  }

  object(name: string): Promise<ObjectDetail> {
    return get(`${this.base}/objects/${encodeURIComponent(name)}`);
  }

  place(id: number): Promise<Place> {
    return get(`${this.base}/places/${id}`);
  }

  async percepts(place: number): Promise<RememberedPercept[]> {
    const path = `${this.base}/places/${place}/percepts`;
    return (await get<{ percepts: RememberedPercept[] }>(path)).percepts;
  }

  /** Where the team went on to from a place. */
  next(place: number, limit: number): Promise<Sequence> {
    return post(`${this.base}/sequence`, { cue: [{ place }], limit });
  }

  async recall(positionM: Vec3, limit: number): Promise<RecalledPlace[]> {
    const body = { position_m: positionM, limit };
    return (await post<{ places: RecalledPlace[] }>(`${this.base}/recall`, body)).places;
  }

  /** The shortest route over the team's ways, from where an agent is to a place. */
  route(agent: string, place: number): Promise<Route> {
    return post(`${this.base}/route`, { from: { agent }, to: { place } });
  }

  /** The agents that follow routes, by name. */
  async following(): Promise<FollowedSummary[]> {
    return this.all<FollowedSummary>("routes", "routes");
  }

  followedRoute(agent: string): Promise<FollowedRoute> {
    return get(`${this.agentPath(agent)}/route`);
  }

  async blockages(): Promise<Blockage[]> {
    return (await get<{ blockages: Blockage[] }>(`${this.base}/blockages`)).blockages;
  }

  async channels(): Promise<Channel[]> {
    return (await get<{ channels: Channel[] }>(`${this.base}/channels`)).channels;
  }

  agent(name: string): Promise<AgentDetail> {
    return get(this.agentPath(name));
  }

  grid(name: string): Promise<GridState> {
    return get(`${this.agentPath(name)}/grid`);
  }

  agentObject(name: string): Promise<AgentObject> {
    return get(`${this.agentPath(name)}/object`);
  }

  /** What the agent would feel after a displacement in its body frame. */
  predict(name: string, translationM: Vec3, rotation: Quat): Promise<Prediction> {
    const increment = { translation_m: translationM, rotation_xyzw: rotation };
    return post(`${this.agentPath(name)}/predict`, { motion: { increment } });
  }

  trajectory(name: string, kind: "causal" | "refined", fromNs?: Int64): Promise<Trajectory> {
    const asked = { kind, limit: 1000, from_ns: fromNs };
    return get(`${this.agentPath(name)}/trajectory?${query(asked)}`);
  }

  private agentPath(name: string): string {
    return `${this.base}/agents/${encodeURIComponent(name)}`;
  }

  /** All pages of a list, up to a bound. */
  private async all<T>(
    path: string,
    field: string,
    parameters: Record<string, string | Int64 | undefined> = {},
  ): Promise<T[]> {
    const items: T[] = [];
    let after = parameters["after"];
    for (let page = 0; page < PAGES_MAX; page += 1) {
      const asked = query({ ...parameters, limit: PAGE_ITEMS, after });
      const answer = await get<Record<string, unknown>>(`${this.base}/${path}?${asked}`);
      const found = answer[field] as T[];
      items.push(...found);
      const next = answer["next"] as string | number | null | undefined;
      // Events have a next page even where it is empty so far.
      if (next === null || next === undefined || found.length < PAGE_ITEMS) {
        break;
      }
      after = next;
    }
    return items;
  }
}
