var U=Math.PI/180;function H([s,t,e]){let o=Math.hypot(s,t,e);if(o<1e-12)return[1,0,0,0,1,0,0,0,1];[s,t,e]=[s/o,t/o,e/o];let r=Math.cos(o),i=Math.sin(o),n=1-r;return[r+s*s*n,s*t*n-e*i,s*e*n+t*i,t*s*n+e*i,r+t*t*n,t*e*n-s*i,e*s*n-t*i,e*t*n+s*i,r+e*e*n]}function $(s,t,e=0){let[o,r]=[Math.cos(s*U),Math.sin(s*U)],[i,n]=[Math.cos(t*U),Math.sin(t*U)],[c,a]=[Math.cos(-e*U),Math.sin(-e*U)],l=X([o,0,r,0,1,0,-r,0,o],[1,0,0,0,i,-n,0,n,i]);return X(l,[c,-a,0,a,c,0,0,0,1])}function X(s,t){let e=new Array(9);for(let o=0;o<3;o++)for(let r=0;r<3;r++)e[3*o+r]=s[3*o]*t[r]+s[3*o+1]*t[3+r]+s[3*o+2]*t[6+r];return e}var N=(s,[t,e,o])=>[s[0]*t+s[1]*e+s[2]*o,s[3]*t+s[4]*e+s[5]*o,s[6]*t+s[7]*e+s[8]*o];function L(s){let{focal:t,center:e,translation:o,width:r,height:i}=s;return{rotation:H(s.rotation),translation:o,focal:t,center:e,width:r,height:i}}function tt(s,t,e,o){let i=N(s.rotation,o).map((a,l)=>a+s.translation[l]),n=$(t,e),c=N(n,o);return{...s,rotation:n,translation:i.map((a,l)=>a-c[l])}}function I(s,t,e,o,r,i=[0,0]){return{...s,focal:s.focal*e,center:[(s.center[0]-t[0])*e+o/2+i[0],(s.center[1]-t[1])*e+r/2+i[1]],width:o,height:r}}function et(s,t,e){let o=N(t,e),r=N(s.rotation,e.map((i,n)=>i-o[n]));return{...s,rotation:X(s.rotation,t),translation:s.translation.map((i,n)=>i+r[n])}}function ot(s,t){let[e,o,r]=N(s.rotation,t).map((n,c)=>n+s.translation[c]),i=s.focal/-r;return[s.center[0]+e*i,s.center[1]-o*i,-r]}function rt({rotation:s,translation:t}){return new Float32Array([s[0],s[3],s[6],0,s[1],s[4],s[7],0,s[2],s[5],s[8],0,t[0],t[1],t[2],1])}function st({focal:s,center:t,width:e,height:o,translation:r}){let i=-r[2],n=Math.max(i-450,i*.05,1),c=i+550;return new Float32Array([2*s/e,0,0,0,0,2*s/o,0,0,1-2*t[0]/e,2*t[1]/o-1,-(c+n)/(c-n),-1,0,0,-2*c*n/(c-n),0])}var v=class extends Error{},nt=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,Dt=64*2**20,St=256*2**20,Ut=16384,y=52,it=8;async function ct(s){let t=new URL(s.endsWith("/")?s:s+"/",document.baseURI),e=async i=>{let n=await fetch(new URL(i,t));if(!n.ok)throw new v(`${i}: ${n.status} ${n.statusText}`);return new Uint8Array(await n.arrayBuffer())},o=["","web/"];t.pathname.endsWith(".avatar/")&&o.reverse();let r=null;for(let i of o){let n=c=>e(i+c);try{let c=JSON.parse(new TextDecoder().decode(await n("avatar.json")));if(!Array.isArray(c.files))return{description:c,file:n}}catch(c){if(!(c instanceof v))throw c;r??=c}}throw r??new v(`${s}: holds no web/avatar.json; bake it again`)}var V=s=>s.geometry??"head.glb";function ht(s){let t=(n,c)=>{if(!n)throw new v(`the bundle's web/avatar.json: ${c}; bake it again`)};t(s&&s.$schema==="urn:bakery:schema:web-1","is not one");let e=String(s.asset?.version);t(/^1\.\d+$/.test(e),`has version ${e.slice(0,20)}, this player reads 1.x`),t(lt(s),"holds a number that is none");let o=s.expressions;t(Array.isArray(o)&&o.length===y,"lacks the 52 expressions"),t(nt.test(V(s)),"names a file outside of its folder"),t(o.every(n=>/^[A-Za-z]{1,40}$/.test(n)),"has an odd expression"),t(s.keys?.length>=1&&s.keys.length<=it,`needs 1 to ${it} keys`),t(s.keys.every(n=>A(n.weights,y)),"keys lack weights"),t(A(s.lips?.rest,80)&&s.lips.shapes?.length===y,"lacks the lips"),t(s.lips.shapes.every(n=>A(n,80)),"lacks the lips"),t(s.mouths?.length>=1&&s.mouths.length<=300,"needs 1 to 300 mouths"),t(s.mouths.every(n=>A(n,80)),"mouths lack landmarks"),t(s.gaze?.length>=1&&s.gaze.every(n=>A(n,2)),"lacks gaze"),t(A(s.pose?.weights,y),"lacks the pose of the photo"),t(A(s.pivot,3)&&s.light?.length===9,"lacks its frame"),t(s.eyes?.cap>0&&A(s.eyes.degrees,2),"lacks eyes"),t(s.eyes.centers?.length===2&&s.eyes.centers.every(n=>A(n,3)),"lacks eyes");for(let n of["photo_camera","front_camera"]){let c=s[n];t(c&&c.focal>0&&A(c.center,2),`lacks ${n}`),t(A(c.rotation,3)&&A(c.translation,3),`lacks ${n}`),t(c.width>0&&c.height>0,`lacks ${n}`)}for(let n of["mouth_sheet","eye_cap_left","eye_cap_right"])t(A(s.uv?.[n],4),`lacks the place of ${n}`);let r=["neutral",...s.keys.map(n=>n.name),"gaze","mouths","masks","coverage"];for(let n of r)t(Object.hasOwn(s.atlases??{},n),"lacks a picture");for(let n of Object.values(s.atlases))t(nt.test(n.file??""),"names a file outside of its folder"),t(at(n.columns)&&at(n.rows),"has an odd grid"),t(n.names?.length<=n.columns*n.rows,"has an odd grid");let i=(n,c)=>t(s.atlases[n].names.length===c,`${n} differ in number`);i("gaze",s.gaze.length),i("mouths",s.mouths.length),i("masks",y)}var A=(s,t)=>Array.isArray(s)&&s.length===t&&s.every(e=>typeof e=="number"),at=s=>Number.isInteger(s)&&s>=1&&s<=1024;function lt(s){return typeof s=="number"?Number.isFinite(s):s&&typeof s=="object"?Object.values(s).every(lt):!0}function Lt(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength),e=o=>String.fromCharCode(...s.subarray(o,o+4));if(s.length>24&&t.getUint32(0)===2303741511)return[t.getUint32(16),t.getUint32(20)];if(s.length>30&&e(0)==="RIFF"&&e(8)==="WEBP"){let o=e(12);if(o==="VP8 ")return[t.getUint16(26,!0)&16383,t.getUint16(28,!0)&16383];if(o==="VP8L"){let r=t.getUint32(21,!0);return[(r&16383)+1,(r>>>14&16383)+1]}if(o==="VP8X"){let r=i=>t.getUint16(i,!0)+(s[i+2]<<16);return[r(24)+1,r(27)+1]}}throw new v("a picture of the bundle is neither PNG nor WebP; bake it again")}async function ft(s,t){let e=await s.file(t.file);if(e.length>St)throw new v(`${t.file}: too large`);let[o,r]=Lt(e);if(o*r>Dt||Math.max(o,r)>Ut)throw new v(`${t.file}: ${o} x ${r} pixels, more than any bundle has`);if(o%t.columns||r%t.rows)throw new v(`${t.file}: does not divide into its grid; bake it again`);let i=e[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([e],{type:i}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var R=class{constructor(t,e,o){this.gl=t,this.handle=t.createProgram();for(let[r,i]of[[t.VERTEX_SHADER,e],[t.FRAGMENT_SHADER,o]]){let n=t.createShader(r);t.shaderSource(n,`#version 300 es
`+i),t.compileShader(n),t.attachShader(this.handle,n),t.deleteShader(n)}t.linkProgram(this.handle),this.places=null}use(){let{gl:t}=this;if(t.useProgram(this.handle),this.places)return;if(!t.getProgramParameter(this.handle,t.LINK_STATUS)&&!t.isContextLost()){let o=t.getAttachedShaders(this.handle).map(r=>t.getShaderInfoLog(r));throw new v(`this browser's graphics refuse a shader: ${o.join(" ").slice(0,300)}`)}this.places=new Map;let e=t.getProgramParameter(this.handle,t.ACTIVE_UNIFORMS);for(let o=0;o<e;o++){let r=t.getActiveUniform(this.handle,o).name.replace("[0]","");this.places.set(r,t.getUniformLocation(this.handle,r))}}at(t){return this.places.get(t)??null}textures(t){let{gl:e}=this,o=0;for(let[r,[i,n]]of Object.entries(t))e.activeTexture(e.TEXTURE0+o),e.bindTexture(i,n),e.uniform1i(this.at(r),o++)}};function D(s,{format:t,width:e,height:o,layers:r=0,linear:i=!1}){let n=r?s.TEXTURE_2D_ARRAY:s.TEXTURE_2D,c=s.createTexture();s.bindTexture(n,c),r?s.texStorage3D(n,1,t,e,o,r):s.texStorage2D(n,1,t,e,o);let a=i?s.LINEAR:s.NEAREST;return s.texParameteri(n,s.TEXTURE_MIN_FILTER,a),s.texParameteri(n,s.TEXTURE_MAG_FILTER,a),s.texParameteri(n,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(n,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),c}var k=class{constructor(t,{format:e,width:o,height:r,count:i=1,linear:n=!1,depth:c=!1}){this.gl=t,this.width=o,this.height=r,this.textures=Array.from({length:i},()=>D(t,{format:e,width:o,height:r,linear:n})),this.handle=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.handle);let a=this.textures.map((l,h)=>(t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+h,t.TEXTURE_2D,l,0),t.COLOR_ATTACHMENT0+h));t.drawBuffers(a),this.depth=null,c&&(this.depth=t.createRenderbuffer(),t.bindRenderbuffer(t.RENDERBUFFER,this.depth),t.renderbufferStorage(t.RENDERBUFFER,t.DEPTH_COMPONENT24,o,r),t.framebufferRenderbuffer(t.FRAMEBUFFER,t.DEPTH_ATTACHMENT,t.RENDERBUFFER,this.depth)),this.complete=t.checkFramebufferStatus(t.FRAMEBUFFER)===t.FRAMEBUFFER_COMPLETE,t.bindFramebuffer(t.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:t}=this;this.textures.forEach(e=>t.deleteTexture(e)),this.depth&&t.deleteRenderbuffer(this.depth),t.deleteFramebuffer(this.handle)}};var Pt=[0,2,4,8];function Y(s,t,e){let o=s.length-e;if(s[0]!==160||o<1)throw new v("packed vertices of another version");let r=new Uint8Array(t*e),i=s.slice(o),n=Math.min((8192/e|0)&-16,256),c=new Uint8Array(256),a=1;for(let l=0;l<t;l+=n){let h=Math.min(n,t-l),p=h+15>>4;for(let f=0;f<e;f++){let d=a;a+=p+3>>2;for(let m=0;m<p;m++){let g=s[d+(m>>2)]>>((m&3)<<1)&3;a=Nt(s,a,Pt[g],c,m<<4)}if(a>o)throw new v("packed vertices that end too soon");let u=i[f];for(let m=0,g=l*e+f;m<h;m++,g+=e){let w=c[m];u=u+(w>>>1^-(w&1))&255,r[g]=u}i[f]=u}}return r}function Nt(s,t,e,o,r){if(e===0)return o.fill(0,r,r+16),t;if(e===8){for(let a=0;a<16;a++)o[r+a]=s[t+a];return t+16}let i=(1<<e)-1,n=8/e,c=t+16/n;for(let a=0;a<16;a++){let l=8-e-a%n*e,h=s[t+(a/n|0)]>>l&i;o[r+a]=h===i?s[c++]:h}return c}function j(s,t){if(s[0]!==209)throw new v("packed indices of another version");let e=new Uint32Array(t),o=new Uint32Array(2),r=1;for(let i=0;i<t;i++){let n=0,c,a=0;do{if(r>=s.length)throw new v("packed indices that end too soon");c=s[r++],n|=(c&127)<<a,a+=7}while(c>127);let l=n&1,h=n>>>1;e[i]=o[l]+=h>>>1^-(h&1)}return e}var P=["eye_cap_left","eye_cap_right","skin","mouth_sheet","tongue","inside","teeth","tear","lashes"],W=P.slice(7),ut=65535;function mt(s){let{document:t,binary:e}=It(s),o=t.meshes?.[0],r=t.nodes?.[0]?.scale;(!o||!r||o.extras?.targetNames?.length!==y)&&b("lacks its 52 shapes");let i=r[0]*1e3,n=new Map(o.primitives.map(m=>[t.materials[m.material].name,m])),c=P.filter(m=>n.has(m));P.slice(0,4).some(m=>!n.has(m))&&b("lacks its skin, eyes or mouth");let a=m=>Bt(t,e,m),l=c.map(m=>t.accessors[n.get(m).attributes.POSITION].count),h=l.reduce((m,g)=>m+g,0);h>ut&&b(`has ${h} vertices, more than ${ut}`);let p=c.map(m=>t.accessors[n.get(m).indices].count),f={positions:new Float32Array(3*h),normals:new Int8Array(4*h),uv:new Float32Array(2*h),part:new Uint8Array(h),indices:new Uint16Array(p.reduce((m,g)=>m+g,0)),shapes:new Int16Array(y*4*h),reach:i,ranges:{}},d=0,u=0;return c.forEach((m,g)=>{let{attributes:w,indices:T,targets:E}=n.get(m),F=a(w.POSITION);for(let x=0;x<F.length;x++)f.positions[3*d+x]=F[x]*i;f.normals.set(a(w.NORMAL),4*d),f.uv.set(a(w.TEXCOORD_0),2*d),f.part.fill(P.indexOf(m),d,d+l[g]);let _=a(T);for(let x=0;x<_.length;x++)_[x]>=l[g]&&b("has a triangle without a corner"),f.indices[u+x]=_[x]+d;E?.length!==y&&b("lacks its 52 shapes"),E.forEach((x,M)=>f.shapes.set(a(x.POSITION),4*(M*h+d))),f.ranges[m]=[u,_.length],d+=l[g],u+=_.length}),f}function b(s){throw new v(`the bundle's head for browsers ${s}; bake it again`)}function It(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength);(s.length<20||t.getUint32(0,!0)!==1179937895)&&b("is no GLB file");let e=t.getUint32(12,!0);return 20+e+8>s.length&&b("is cut short"),{document:JSON.parse(new TextDecoder().decode(s.subarray(20,20+e))),binary:s.subarray(28+e)}}var Ct={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Bt(s,t,e){let o=s.accessors[e],r=s.bufferViews[o.bufferView].extensions.EXT_meshopt_compression,{byteOffset:i=0,byteLength:n,byteStride:c,count:a,mode:l}=r;(a!==o.count||a>4*2**20||c>256)&&b("is damaged"),i+n>t.length&&b("is cut short");let h=t.subarray(i,i+n),p=Ct[o.componentType];return l==="ATTRIBUTES"?new p(Y(h,a,c).buffer):p.from(j(h,a))}var C=class{constructor(t,e){this.size=e.rest.length,this.known=new Float64Array(t.length*this.size),this.length=new Float64Array(t.length),t.forEach((o,r)=>{this.known.set(o,r*this.size),this.length[r]=Math.hypot(...o)}),this.rest=Float64Array.from(e.rest),this.shapes=e.shapes.map(o=>Float64Array.from(o)),this.moves=this.shapes.map(o=>o.some(r=>r!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(t.length),this.order=Array.from(t,(o,r)=>r),this.count=Math.min(50,t.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(t){let{wanted:e,known:o,score:r,size:i,order:n}=this;e.set(this.rest);for(let u=0;u<t.length;u++){let m=t[u];if(m===0||!this.moves[u])continue;let g=this.shapes[u];for(let w=0;w<i;w++)e[w]+=m*g[w]}let c=0;for(let u=0;u<i;u++)c+=e[u]*e[u];let a=Math.sqrt(c);for(let u=0,m=0;u<r.length;u++){let g=0;for(let w=0;w<i;w++,m++)g+=o[m]*e[w];r[u]=g/(this.length[u]*a)}n.sort((u,m)=>r[m]-r[u]||u-m);let l=1-r[n[0]],h=Math.max(.25*l,1e-4),p=0,f=!1,d=new Float64Array(this.count);for(let u=0;u<this.count;u++)d[u]=Math.exp((l-(1-r[n[u]]))/h),p+=d[u];for(let u=0;u<this.count;u++){let m=d[u]/p;f||=this.index[u]!==n[u]||Math.abs(this.weight[u]-m)>1e-7,this.index[u]=n[u],this.weight[u]=m}return f}};function pt(s,t){let e=0,o=1/0;return s.forEach(([r,i],n)=>{let c=(r-t[0])**2+(i-t[1])**2;c<o&&([e,o]=[n,c])}),e}var dt=64,Ot=.12,B=class{constructor(t,e){this.view=L(t.photo_camera),this.columns=dt,this.rows=Math.max(8,Math.round(dt*this.view.height/this.view.width)),this.step=e.reach/32767;let o=t.pose.weights,r=this.#t(e,o);this.mass=this.#o(r),this.cells=Int32Array.from(r.keys()).filter(c=>r[c]>=0);let i=this.cells.length,n=e.part.length;this.rest=new Float32Array(3*i),this.shapes=o.map(()=>new Int16Array(3*i)),this.cells.forEach((c,a)=>{let l=r[c];for(let h=0;h<3;h++)this.rest[3*a+h]=e.positions[3*l+h],this.shapes.forEach((p,f)=>{p[3*a+h]=e.shapes[4*(f*n+l)+h]})}),this.place=new Float32Array(3*i),this.values=new Float32Array(2*r.length),this.before=new Float32Array(2*i),this.#r(o,this.before)}#t(t,e){let{columns:o,rows:r}=this,[i,n]=t.ranges.skin,c=t.part.length,a=[...new Set(t.indices.subarray(i,i+n))],l=Float32Array.from({length:3*a.length},(u,m)=>t.positions[3*a[Math.floor(m/3)]+m%3]);e.forEach((u,m)=>{if(u)for(let g=0;g<a.length;g++){let w=4*(m*c+a[g]);for(let T=0;T<3;T++)l[3*g+T]+=u*this.step*t.shapes[w+T]}});let h=new Float32Array(2*a.length),p=this.#e(l,h),f=new Int32Array(o*r).fill(-1),d=new Float32Array(f.length).fill(1/0);for(let u=0;u<a.length;u++){let m=Math.floor(h[2*u]*o),g=Math.floor(h[2*u+1]*r);if(m<0||g<0||m>=o||g>=r)continue;let w=g*o+m;p[u]<d[w]&&([d[w],f[w]]=[p[u],a[u]])}return f}#e(t,e){let{rotation:o,translation:r,focal:i,center:n,width:c,height:a}=this.view,l=t.length/3,h=new Float32Array(l);for(let p=0;p<l;p++){let[f,d,u]=[t[3*p],t[3*p+1],t[3*p+2]];h[p]=-(o[6]*f+o[7]*d+o[8]*u+r[2]);let m=i/h[p];e[2*p]=(n[0]+(o[0]*f+o[1]*d+o[2]*u+r[0])*m)/c,e[2*p+1]=(n[1]-(o[3]*f+o[4]*d+o[5]*u+r[1])*m)/a}return h}#r(t,e){this.place.set(this.rest),this.shapes.forEach((o,r)=>{let i=t[r]*this.step;if(i!==0)for(let n=0;n<o.length;n++)this.place[n]+=i*o[n]}),this.#e(this.place,e)}#o(t){let{columns:e,rows:o}=this,r=Float32Array.from(t,c=>c>=0?0:1e3),i=(c,a,l)=>{r[a]+l<r[c]&&(r[c]=r[a]+l)};for(let c=0;c<2;c++)for(let a=0;a<r.length;a++){let l=c?r.length-1-a:a,h=l%e,p=(l-h)/e,f=c?1:-1;h+f>=0&&h+f<e&&i(l,l+f,1),p+f>=0&&p+f<o&&(i(l,l+f*e,1),h>0&&i(l,l+f*e-1,1.4),h<e-1&&i(l,l+f*e+1,1.4))}let n=Ot*o;return r.map(c=>c===0?1:Math.min(Math.max(c/n-1,0),1))}at(t){let{cells:e,values:o,before:r}=this,i=new Float32Array(r.length);this.#r(t,i);for(let n=0;n<e.length;n++)o[2*e[n]]=r[2*n]-i[2*n],o[2*e[n]+1]=r[2*n+1]-i[2*n+1];return gt(o,this.mass,this.columns,this.rows)}};function gt(s,t,e,o){if(Math.min(e,o)<2)return s;let[r,i]=[e+1>>1,o+1>>1],n=new Float32Array(2*r*i),c=new Float32Array(r*i);for(let h=0;h<o;h++)for(let p=0;p<e;p++){let f=h*e+p,d=(h>>1)*r+(p>>1);c[d]+=t[f],n[2*d]+=t[f]*s[2*f],n[2*d+1]+=t[f]*s[2*f+1]}for(let h=0;h<c.length;h++){let p=c[h]>0?1/c[h]:0;n[2*h]*=p,n[2*h+1]*=p,c[h]=Math.min(1,c[h])}let a=gt(n,c,r,i),l=new Float32Array(s.length);for(let h=0;h<o;h++)for(let p=0;p<e;p++){let f=h*e+p,d=Math.min(Math.max((p-.5)/2,0),r-1),u=Math.min(Math.max((h-.5)/2,0),i-1),[m,g]=[Math.floor(d),Math.floor(u)],[w,T]=[Math.min(m+1,r-1),Math.min(g+1,i-1)];for(let E=0;E<2;E++){let F=a[2*(g*r+m)+E]*(1-d+m)+a[2*(g*r+w)+E]*(d-m),_=a[2*(T*r+m)+E]*(1-d+m)+a[2*(T*r+w)+E]*(d-m),x=F*(1-u+g)+_*(u-g);l[2*f+E]=t[f]*s[2*f+E]+(1-t[f])*x}}return l}var wt=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,S=`
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`,vt=`
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`,xt=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`,Et=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`,yt=`
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`,At=`
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
uniform vec2 cards; // how much of the left and of the right eye's lashes shows
const float BEHIND = 8.0; // mm
flat out float shows;
out vec2 uv;
out vec3 toward;
out vec3 bent;
out vec2 place; // mm: height at rest and depth
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  toward = mat3(view) * normal.xyz;
  place = vec2(position.y, p.z);
  shows = position.x < 0.0 ? cards.y : cards.x;
  vec4 seen = view * vec4(p, 1.0);
  gl_Position = projection * seen;
  if (piece == 3u) { // farther, for the tongue; render.BEHIND is the reference
    vec4 behind = projection * (seen - vec4(0.0, 0.0, BEHIND, 0.0));
    gl_Position.z = behind.z / behind.w * gl_Position.w;
  }
}`,Tt=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 toward;
in vec3 bent;
in vec2 place;
flat in float shows;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow, hair;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft, geometry;
uniform vec3 light[9];
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
out vec4 color;
${wt}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
// As the reference reads it: no mipmaps, colour multiplied by alpha before it is mixed.
vec4 exactCard(vec2 uv) {
  ivec2 size = textureSize(hair, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(hair, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(one.rgb * one.a, one.a);
  }
  return vec4(sum.rgb / max(sum.a, 1e-6), sum.a);
}
float harmonics(vec3 n) {
  vec3 sum = 0.282095 * light[0] + 0.488603 * (n.y * light[1] + n.z * light[2] + n.x * light[3])
    + 1.092548 * (n.x * n.y * light[4] + n.y * n.z * light[5] + n.x * n.z * light[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * light[6] + 0.546274 * (n.x * n.x - n.y * n.y) * light[8];
  return dot(sum, vec3(0.2126, 0.7152, 0.0722));
}
float studio(vec3 n) {
  float key = max(dot(n, normalize(vec3(-0.55, 0.6, 0.65))), 0.0);
  float fill = 0.5 + 0.5 * dot(n, normalize(vec3(0.7, 0.15, 0.5)));
  float rim = pow(1.0 - clamp(n.z, 0.0, 1.0), 3.0) * max(n.y + 0.4, 0.0);
  return 0.85 * key + 0.32 * fill + 0.5 * rim + 0.1;
}
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  if (part > 6u) { // lashes and tear line
    vec4 card = soft ? texture(hair, uv) : exactCard(uv);
    color = vec4(toEncoded(card.rgb), card.a * shows);
    return;
  }
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else if (geometry) c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    vec3 n = normalize(bent);
    float was = harmonics(n) / max(harmonics(vec3(0.0, 0.0, 1.0)), 0.05);
    float now = studio(normalize(toward)) / studio(vec3(0.0, 0.0, 1.0));
    float ratio = clamp(now / max(was, 0.35), 0.15, 2.2);
    c *= part == 2u ? ratio : mix(1.0, ratio, 0.5);
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
  }
  color = vec4(toEncoded(c), alpha);
}`,_t=`
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${wt}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var O=256;async function q(s){let{atlases:t,keys:e}=s.description,r=["neutral",...e.map(n=>n.name),"gaze","mouths","masks","coverage","hair","photo"].filter(n=>Object.hasOwn(t,n)),i=await Promise.all(r.map(n=>ft(s,t[n])));return Object.fromEntries(r.map((n,c)=>[n,i[c]]))}var z=class{constructor(t,e,o,r){this.gl=t;let i=t.getParameter(t.MAX_TEXTURE_SIZE);for(let[n,c]of Object.entries(o))if(Math.max(c.width,c.height)>i)throw new v(`${n}: ${c.width} x ${c.height} texels, this device takes ${i}; bake with --preset mobile`);t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.pixelStorei(t.UNPACK_FLIP_Y_WEBGL,!1),this.side=o.neutral.width,this.faces=this.#t(["neutral",...e.keys.map(n=>n.name)].map(n=>o[n])),this.mouths=this.#e(o.mouths,t.RGBA8),this.gaze=this.#e(o.gaze,t.RGBA8),this.coverage=this.#e(o.coverage??Z(255),t.RGBA8,!0),this.hairy=!!o.hair,this.hair=this.#e(o.hair??Z(0),t.SRGB8_ALPHA8,!0,this.hairy),this.photo=this.#e(o.photo??Z(0),t.SRGB8_ALPHA8,!0,!!o.photo),this.masks=this.#r(o.masks,e.atlases.masks),this.#o(r)}#t(t){let{gl:e,side:o}=this,r=D(e,{format:e.SRGB8_ALPHA8,width:o,height:o,layers:t.length});return t.forEach((i,n)=>{if(i.width!==o||i.height!==o)throw new v("face pictures differ in size; bake the bundle again");e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,n,o,o,1,e.RGBA,e.UNSIGNED_BYTE,i)}),r}#e(t,e,o=!1,r=!1){let{gl:i}=this,n=i.createTexture();i.bindTexture(i.TEXTURE_2D,n);let{width:c,height:a}=t,l=r?Math.floor(Math.log2(Math.max(c,a)))+1:1;i.texStorage2D(i.TEXTURE_2D,l,e,c,a),t.data?i.texSubImage2D(i.TEXTURE_2D,0,0,0,c,a,i.RGBA,i.UNSIGNED_BYTE,t.data):i.texSubImage2D(i.TEXTURE_2D,0,0,0,i.RGBA,i.UNSIGNED_BYTE,t),r&&i.generateMipmap(i.TEXTURE_2D);let h=o?i.LINEAR:i.NEAREST;return i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,r?i.LINEAR_MIPMAP_LINEAR:h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_S,i.CLAMP_TO_EDGE),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_T,i.CLAMP_TO_EDGE),n}#r(t,e){let{gl:o}=this,r=t.width/e.columns,i=Math.ceil(y/4),n=this.#e(t,o.RGBA8),c=D(o,{format:o.RGBA8,width:r,height:r,layers:i,linear:!0}),a=new R(o,S,vt),l=o.createFramebuffer();o.bindFramebuffer(o.FRAMEBUFFER,l),o.viewport(0,0,r,r),o.disable(o.DEPTH_TEST),o.disable(o.BLEND),o.disable(o.CULL_FACE),a.use(),a.textures({atlas:[o.TEXTURE_2D,n]}),o.uniform1i(a.at("columns"),e.columns),o.uniform1i(a.at("count"),y),o.uniform1i(a.at("side"),r);for(let h=0;h<i;h++)o.framebufferTextureLayer(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,c,0,h),o.uniform1i(a.at("first"),4*h),o.drawArrays(o.TRIANGLES,0,3);return o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteFramebuffer(l),o.deleteTexture(n),o.deleteProgram(a.handle),this.maskSide=r,c}#o(t){let{gl:e}=this,o=t.part.length;this.array=e.createVertexArray(),e.bindVertexArray(this.array);let r=(l,h,p,f,d)=>{e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,h,e.STATIC_DRAW),e.enableVertexAttribArray(l),f===e.UNSIGNED_BYTE?e.vertexAttribIPointer(l,p,f,0,0):e.vertexAttribPointer(l,p,f,d,0,0)};r(0,t.positions,3,e.FLOAT,!1),r(1,t.normals,4,e.BYTE,!0),r(2,t.uv,2,e.FLOAT,!1),r(3,t.part,1,e.UNSIGNED_BYTE,!1),e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,t.indices,e.STATIC_DRAW),e.bindVertexArray(null);let i=Math.ceil(o/O);this.shapes=D(e,{format:e.RGBA16I,width:O,height:i,layers:y});let n=new Int16Array(4*O*i);for(let l=0;l<y;l++)n.set(t.shapes.subarray(4*l*o,4*(l+1)*o)),e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,l,O,i,1,e.RGBA_INTEGER,e.SHORT,n);this.step=t.reach/32767;let c=l=>l.filter(h=>t.ranges[h]).map(h=>t.ranges[h]),a=P.filter(l=>!W.includes(l));this.runs={image:K(c(a.slice(0,5))),geometry:K(c(a.filter(l=>l!=="mouth_sheet"))),cards:this.hairy?K(c(W)):[]}}};function K(s){let t=[];for(let[e,o]of s){let r=t.at(-1);r&&r[0]+r[1]===e?r[1]+=o:t.push([e,o])}return t}var Z=s=>({width:1,height:1,data:new Uint8Array(4).fill(s)});function Rt(s,t,e,o){let r=s.getExtension("EXT_color_buffer_float")||s.getExtension("EXT_color_buffer_half_float"),i=l=>new k(s,{format:l,width:t,height:t,linear:!0}),n=l=>new k(s,{format:l,width:e,height:e,count:2,linear:!0}),c=r&&{face:i(s.RGBA16F),weights:n(s.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:i(s.SRGB8_ALPHA8),weights:n(s.RGBA8)});let a=new k(s,{format:s.RGBA8,width:o[0],height:o[1]});return{...c,mouth:a}}var zt=["color","mask","coverage","uv"],Gt=74,bt=.25,Xt=[8,32],Ht=[.2,.75];function J(s){return{weights:new R(s,S,xt),compose:new R(s,S,Et),median:new R(s,S,yt),backdrop:new R(s,S,_t),head:new R(s,At,Tt)}}var G=class{#t;#e;#r;#o;#s;#n=null;#i=null;#a=new Float32Array(416);#c=new Float32Array(100);#l=new Float32Array(104);#f;#h;constructor(t,e,o,r,i){this.#t=t,this.#e=e,this.#r=o,this.#o=i,this.#s=new z(t,e,r,o);let n=c=>{let{columns:a,rows:l}=e.atlases[c];return[r[c].width/a,r[c].height/l]};this.mouthCell=n("mouths"),this.gazeCell=n("gaze"),this.targets=Rt(t,this.#s.side,this.#s.maskSide,this.mouthCell),this.bottom=o.positions.reduce((c,a,l)=>l%3===1?Math.min(c,a):c,0),this.lips=$t(o,"mouth_sheet"),this.#f=H(e.photo_camera.rotation),this.#h=["Left","Right"].map(c=>e.expressions.indexOf("eyeBlink"+c)),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0}}start(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0});let t=this.#t;t.disable(t.DEPTH_TEST),t.disable(t.BLEND),t.disable(t.CULL_FACE)}compose(t,e,o){let r=this.#t,{weights:i,compose:n}=this.#o,c=this.#s,{keys:a}=this.#e,l=o&&c.hairy,h=[];this.#a.fill(0);for(let d=0;d<t.length;d++){let u=e?t[d]:0;if(u===0||!a.some(g=>g.weights[d]))continue;let m=d>>2;h.at(-1)!==m&&h.push(m),a.forEach((g,w)=>{this.#a[4*(8*m+w)+(d&3)]=g.weights[d]*u})}this.targets.weights.bind(),i.use(),i.textures({masks:[r.TEXTURE_2D_ARRAY,c.masks]}),r.uniform1i(i.at("groups"),h.length),h.length&&r.uniform1iv(i.at("group"),h),r.uniform4fv(i.at("product"),this.#a),this.#u(4+4*h.length+this.#a.byteLength),this.targets.face.bind(),n.use();let[p,f]=this.targets.weights.textures;n.textures({faces:[r.TEXTURE_2D_ARRAY,c.faces],low:[r.TEXTURE_2D,p],high:[r.TEXTURE_2D,f],hair:[r.TEXTURE_2D,c.hair]}),r.uniform1i(n.at("keys"),h.length?a.length:0),r.uniform1i(n.at("hairy"),Number(l)),this.#u(8),this.stats.compositions++}median(t){let e=this.#t,o=this.#o.median;for(let r=0;r<t.count;r++)this.#c[2*r]=t.index[r],this.#c[2*r+1]=t.weight[r];this.targets.mouth.bind(),o.use(),o.textures({mouths:[e.TEXTURE_2D,this.#s.mouths]}),e.uniform1i(o.at("columns"),this.#e.atlases.mouths.columns),e.uniform1i(o.at("count"),t.count),e.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),e.uniform2fv(o.at("neighbour"),this.#c),this.#u(16+this.#c.byteLength),this.stats.medians++}pull(t){let e=this.#t;this.#n??=new B(this.#e,this.#r);let{columns:o,rows:r}=this.#n;this.#i??=D(e,{format:e.RG16F,width:o,height:r,linear:!0}),e.bindTexture(e.TEXTURE_2D,this.#i);let i=this.#n.at(t);e.texSubImage2D(e.TEXTURE_2D,0,0,0,o,r,e.RG,e.FLOAT,i)}#p(t,e){let[o,r]=[t.rotation,this.#f].map(c=>c.slice(6)),i=Math.min(o[0]*r[0]+o[1]*r[1]+o[2]*r[2],1),n=kt(Xt,Math.acos(i)*180/Math.PI);return this.#h.map(c=>bt+(1-bt)*Math.max(n,kt(Ht,e[c])))}#m(t){let e=this.#t;for(let[o,r]of t)e.drawElements(e.TRIANGLES,r,e.UNSIGNED_SHORT,2*o),this.stats.drawCalls++}#u(t){this.#t.drawArrays(this.#t.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=t}picture(t,{weights:e,gaze:o,options:r,inPhoto:i,shown:n},c){let a=this.#t,l=this.#e,h=this.#s,{backdrop:p,head:f}=this.#o;a.disable(a.BLEND),a.disable(a.CULL_FACE),a.disable(a.DEPTH_TEST);let d=t.focal/l.photo_camera.focal,u=[t.center[0]-l.photo_camera.center[0]*d,t.center[1]-l.photo_camera.center[1]*d,l.photo_camera.width*d,l.photo_camera.height*d],m=i?this.#i:h.hair;p.use(),p.textures({photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m]}),a.uniform4fv(p.at("frame"),u),a.uniform2f(p.at("size"),t.width,t.height),a.uniform1i(p.at("inPhoto"),Number(i)),a.uniform1i(p.at("plain"),Number(c&&!i)),a.uniform3fv(p.at("wall"),r.wall),a.uniform3fv(p.at("floorTint"),r.floor),this.#u(56),a.enable(a.DEPTH_TEST),a.clear(a.DEPTH_BUFFER_BIT),a.enable(a.CULL_FACE),c||(a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA)),f.use(),f.textures({face:[a.TEXTURE_2D,this.targets.face.textures[0]],mouth:[a.TEXTURE_2D,this.targets.mouth.textures[0]],gaze:[a.TEXTURE_2D,h.gaze],coverage:[a.TEXTURE_2D,h.coverage],photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m],hair:[a.TEXTURE_2D,h.hair],masks:[a.TEXTURE_2D_ARRAY,h.masks],shapes:[a.TEXTURE_2D_ARRAY,h.shapes]});let g=0;for(let M=0;M<e.length;M++)e[M]!==0&&(this.#l[2*g]=M,this.#l[2*g+++1]=e[M]*h.step);let w=pt(l.gaze,o),T=2*l.eyes.cap,{columns:E}=l.atlases.gaze,[F,_]=this.gazeCell;a.uniformMatrix4fv(f.at("view"),!1,rt(t)),a.uniformMatrix4fv(f.at("projection"),!1,st(t)),a.uniform1i(f.at("count"),g),g&&a.uniform2fv(f.at("moving"),this.#l.subarray(0,2*g));let{uv:x}=l;a.uniform4fv(f.at("places"),[...x.eye_cap_left,...x.eye_cap_right,...x.mouth_sheet]),a.uniform2i(f.at("eyeCell"),F/2,_),a.uniform2i(f.at("eyeCorner"),w%E*F,Math.floor(w/E)*_),a.uniform2f(f.at("slide"),(o[0]-l.gaze[w][0])/T,(l.gaze[w][1]-o[1])/T),a.uniform1i(f.at("layer"),zt.indexOf(r.layer)),a.uniform1i(f.at("shown"),n),a.uniform1i(f.at("lit"),Number(r.light&&!i&&!c)),a.uniform1i(f.at("inPhoto"),Number(i)),a.uniform1i(f.at("soft"),+!c),a.uniform1f(f.at("scale"),-t.focal/t.translation[2]),a.uniform3fv(f.at("light"),l.light.flat()),a.uniform2fv(f.at("cards"),this.#p(t,e)),a.uniform1f(f.at("lips"),this.lips),a.uniform1i(f.at("geometry"),+(r.mouth==="geometry")),a.uniform2f(f.at("fade"),this.bottom+2,this.bottom+Gt),a.uniform4fv(f.at("frame"),u),a.uniform1f(f.at("tall"),t.height),this.stats.uniformBytes+=128+8*g+48+24+24+108+8+28+8,a.bindVertexArray(h.array),this.#m(r.mouth==="geometry"?h.runs.geometry:h.runs.image),r.layer==="color"&&(a.disable(a.CULL_FACE),a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA),a.depthMask(!1),this.#m(h.runs.cards),a.depthMask(!0)),a.bindVertexArray(null)}};function kt(s,t){let[e,o]=s,r=Math.min(Math.max((t-e)/(o-e),0),1);return r*r*(3-2*r)}function $t(s,t){let[e,o]=s.ranges[t],r=0;for(let i=e;i<e+o;i++)r+=s.positions[3*s.indices[i]+2];return r/o}var Vt=-40,Yt=[0,-75,-45],be=[32,24],Ft=[35,30];async function ke(s,{canvas:t,antialias:e=!0}){let o=t.getContext("webgl2",{antialias:e,alpha:!1,powerPreference:"high-performance"});if(!o)throw new v("this browser has no WebGL 2; update it, or turn hardware acceleration on");let r=typeof s=="string"?await ct(s):s;ht(r.description);let i=J(o),[n,c]=await Promise.all([q(r),r.file(V(r.description))]);return new Q(o,r,n,mt(c),i)}var Q=class{#t;#e;#r;#o;#s=!1;#n=!0;#i=!0;#a="";constructor(t,e,o,r,i){this.#t=t,this.#e=e,this.#r=r;let n=e.description;this.about=n,this.expressions=n.expressions,this.canvas=t.canvas,this.weights=new Float32Array(n.expressions.length),this.index=new Map(n.expressions.map((c,a)=>[c,a])),this.hasPhoto=!!n.atlases.photo,this.hasHair=!!n.atlases.hair,this.options={stage:"studio",dynamic:!0,hair:!0,mouth:"image",light:!1,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new C(n.mouths,n.lips),this.#c(o,i),this.canvas.addEventListener("webglcontextlost",c=>{c.preventDefault(),this.#s=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#l())}#c(t,e){this.#o=new G(this.#t,this.about,this.#r,t,e),this.stats=this.#o.stats,Object.values(t).forEach(o=>o.close()),this.mouths.weight.fill(-1),this.#n=this.#i=!0}async#l(){let t=J(this.#t);this.#c(await q(this.#e),t),this.#s=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(t){for(let[e,o]of Object.entries(t)){let r=this.index.get(e);if(r===void 0)throw new v(`no expression '${String(e).slice(0,40)}'`);if(!Number.isFinite(o))throw new v(`${e}: ${o} is no weight`);let i=Math.fround(Math.min(Math.max(o,0),1));this.weights[r]!==i&&(this.weights[r]=i,e.startsWith("eyeLook")&&(this.direction=null),this.#n=this.#i=!0)}return this}get(t){return this.weights[this.index.get(t)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#n=this.#i=!0,this}look(t,e){if(!Number.isFinite(t+e))throw new v("gaze is no number");let[o,r]=this.about.eyes.degrees;for(let[i,n]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+i]:Number(n)*t/o,["eyeLookIn"+i]:-Number(n)*t/o,["eyeLookUp"+i]:e/r,["eyeLookDown"+i]:-e/r});return this.direction=[t,e],this}get gaze(){if(this.direction)return this.direction.map((n,c)=>Math.min(Math.max(n,-Ft[c]),Ft[c]));let[t,e]=this.about.eyes.degrees,o=n=>this.get(n),r=o("eyeLookOutLeft")-o("eyeLookInLeft")-o("eyeLookOutRight")+o("eyeLookInRight"),i=o("eyeLookUpLeft")-o("eyeLookDownLeft")+o("eyeLookUpRight")-o("eyeLookDownRight");return[t*r/2,e*i/2]}turn(t,e,o=0){if(!Number.isFinite(t+e+o))throw new v("a head turn is no number");return this.head=[t,e,o],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(t=this.canvas.width,e=this.canvas.height){let{about:o,orbit:r}=this,i=r.shift.map(h=>h*e);if(this.inPhoto){let{width:h,height:p}=o.photo_camera,f=Math.min(t/h,e/p)*r.zoom;return I(L(o.photo_camera),[h/2,p/2],f,t,e,i)}let n=L(o.front_camera),c=.74*Math.min(t*1.12,e)*r.zoom/n.width,a=[n.width/2,n.height*.5],l=tt(I(n,a,c,t,e,i),r.yaw,r.pitch,[0,o.pivot[1],Vt]);return this.head.some(Boolean)?et(l,$(...this.head),Yt):l}frontView(t){let e=L(this.about.front_camera);return I(e,[e.width/2,e.height/2],t/e.width,t,t)}eyes(){let t=this.view();return this.about.eyes.centers.map(([e,o,r])=>{let[i,n,c]=ot(t,[e,o,r+11]);return[i,n,13*t.focal/c]})}render(){if(this.#s)return;let t=performance.now();this.#h();let e=this.#t;e.bindFramebuffer(e.FRAMEBUFFER,null),e.viewport(0,0,this.canvas.width,this.canvas.height),this.#o.picture(this.view(),this.#f(),!1),this.stats.milliseconds=performance.now()-t}capture({width:t,height:e,view:o=this.view(t,e)}){let r=this.#t;this.#h();let i=new k(r,{format:r.RGBA8,width:t,height:e,depth:!0});i.bind(),this.#o.picture(o,this.#f(),!0);let n=Mt(r,t,e);return i.dispose(),jt(n,t,e)}mouthSheet(){this.#h();let{mouth:t}=this.#o.targets;return t.bind(),{width:t.width,height:t.height,data:Mt(this.#t,t.width,t.height)}}#f(){let{weights:t,gaze:e,options:o,inPhoto:r}=this;return{weights:t,gaze:e,options:o,inPhoto:r,shown:this.index.get(o.layerExpression)??0}}#h(){let t=this.#o,{dynamic:e,hair:o}=this.options;t.start();let r=`${e} ${o}`;(this.#n||r!==this.#a)&&(t.compose(this.weights,e,o),this.mouths.find(this.weights)&&t.median(this.mouths),this.#n=!1,this.#a=r),this.inPhoto&&this.#i&&(t.pull(this.weights),this.#i=!1)}dispose(){this.#t.getExtension("WEBGL_lose_context")?.loseContext()}};function Mt(s,t,e){let o=new Uint8Array(4*t*e);return s.pixelStorei(s.PACK_ALIGNMENT,1),s.readPixels(0,0,t,e,s.RGBA,s.UNSIGNED_BYTE,o),s.bindFramebuffer(s.FRAMEBUFFER,null),o}function jt(s,t,e){let o=new Uint8Array(s.length);for(let r=0;r<e;r++)o.set(s.subarray(4*t*r,4*t*(r+1)),4*t*(e-1-r));return o}export{Q as Avatar,v as AvatarError,be as MOST_GAZE,j as decodeIndices,Y as decodeVertices,ke as load,mt as parseHead};
